"""What a report gets of a calibration: every number, and every rest with what is left over."""

import math

import numpy as np
import pytest
import seen_arms

from laptop.measure.arm.arm_fit import fit_arm
from laptop.measure.arm.arm_result import measured
from laptop.measure.arm.calibrating import Identified
from laptop.measure.arm.calibration_record import calibration_run, rests_table
from laptop.measure.arm.pose_plan import scouts

TABLE = seen_arms.table()


@pytest.fixture(scope="module")
def done():
    rests = seen_arms.rests(TABLE, 20, noise_px=0.2)
    rests.pixels["A"][7] = np.nan
    fit = fit_arm(seen_arms.model(TABLE), rests)
    times = 5.0 * np.arange(20)
    return Identified(fit, rests, scouts(seen_arms.ARM, 20), times, 100.0)


def test_the_summary_has_each_number_and_null_for_what_is_unknown(done, tmp_path):
    rows = measured(done.fit)
    camera = TABLE.calibrated(np.random.default_rng(1), 98.5)
    run, files = calibration_run(done, rows, camera)
    values = {row["what"]: row["value"] for row in run.rows("values")}
    assert (run.kind, run.ending.reason, run.ending.seconds) == ("calibration", "calibrated", 100)
    assert (values["poses"], values["the board's bar mm"]) == (20, 98.5)
    numbers = {row["number"]: row for row in run.rows("numbers")}
    link = numbers["shoulder: link"]
    assert link["is"] == pytest.approx(done.fit.value("shoulder.link"), abs=1e-4)
    assert link["standard uncertainty"] == pytest.approx(done.fit.sigma("shoulder.link"), abs=1e-4)
    unknown = numbers["elbow: link"]
    assert (unknown["is"], unknown["standard uncertainty"]) == (None, None)
    assert "touch crosses" in unknown["remark"]
    write, _ = files["rests.csv"]
    write(str(tmp_path / "rests.csv"))
    assert len((tmp_path / "rests.csv").read_text().splitlines()) == 21


def test_the_rests_have_joints_in_degrees_and_what_the_fit_leaves_over(done):
    heading, *rows = rests_table(done)
    told = [dict(zip(heading, row, strict=True)) for row in rows]
    assert told[7]["u_px"] == told[7]["off_v_px"] == ""
    assert float(told[3]["elbow_deg"]) == pytest.approx(
        math.degrees(done.rests.joint_states.e[3, 1]), abs=1e-3
    )
    assert told[3]["t_s"] == "15.00"
    off = np.array([[float(r["off_u_px"]), float(r["off_v_px"])] for r in told if r["u_px"]])
    assert 0.05 < np.sqrt((off**2).mean()) < 0.4, "px: 0.2 was the noise"

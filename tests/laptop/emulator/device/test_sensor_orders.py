"""What people write of sensors: what it means, and what is refused."""

import pytest

from laptop.emulator.device.sensor_orders import BadSensor, read_sensor, read_sensors


@pytest.fixture
def csv(tmp_path):
    def write(text, name="lab ä.csv"):
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return path

    return write


def values(text, key, *times):
    signal = read_sensor(text).quantities[key]
    return [signal.value(t) for t in times]


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("30", [30, 30, 30, 30, 30, 30]),
        ("12..80/5s", [12, 25.6, 80, 66.4, 12, 25.6]),
        ("12..80/5", [12, 25.6, 80, 66.4, 12, 25.6]),
        ("80..12/5s", [80, 66.4, 12, 25.6, 80, 66.4]),
        ("7:9@5:8@11", [7, 7, 9, 9, 9, 8]),
        ("7:0..10/2s@6", [7, 7, 7, 0, 10, 0]),
    ],
)
def test_values_over_time(text, wanted):
    times = (0, 1, 5, 6, 10, 11)
    if text.endswith("@6"):
        times = (0, 1, 5, 6, 8, 10)
    assert values(f"in2=ultrasonic:{text}", "distance", *times) == pytest.approx(wanted)


def test_rates_and_integrals():
    ramp = read_sensor("in1=gyro:10..-20/3s").quantities["angle"]
    assert [ramp.slope(t) for t in (0, 2, 4, 7)] == pytest.approx([-10, -10, 10, -10])
    # Of a whole round of 6 s the mean is -5: -30; in the first second it falls from 10 to 0: 5.
    assert [ramp.integral(t) for t in (0, 1, 6, 7)] == pytest.approx([0, 5, -30, -25])
    steps = read_sensor("in1=gyro,rate=2:-3@4:0..6/1s@5").quantities["rate"]
    assert [steps.integral(t) for t in (3, 5, 6, 7.5)] == pytest.approx([6, 5, 8, 11.75])
    assert steps.slope(4.5) == 0


def test_the_integral_of_a_file(csv):
    """From 10 at 1 s, and level before, to 30 at 3 s."""
    file = csv("1,10\n3,30\n")
    rate = read_sensor(f"in1=gyro,rate={file}").quantities["rate"]
    assert [rate.integral(t) for t in (0.5, 1, 2, 3, 4)] == pytest.approx([5, 10, 25, 50, 80])


def test_words_and_whole_numbers_jump():
    assert values("in1=color:white:black@2", "surface", 0, 1.99, 2) == ["white", "white", "black"]
    assert values("in1=touch:0:1@2", "pressed", 0, 1.99, 2) == [0, 0, 1]


def test_what_a_value_without_a_key_means():
    assert set(read_sensor("in1=color:30").quantities) == {"reflect"}
    assert set(read_sensor("in1=color:red").quantities) == {"surface"}
    assert read_sensor("in1=color:line,x=5").quantities["reflect"] == "line"
    assert set(read_sensor("in1=color:red=30").quantities) == {"red"}
    assert set(read_sensor("in1=color,red=30,blue=4").quantities) == {"red", "blue"}
    assert read_sensor("in1=color").quantities == {}
    both = read_sensor("in1=infrared:30,heading=4,2.heading=5").quantities
    assert set(both) == {"distance", "1.heading", "2.heading"}
    assert read_sensor("in1=ultrasonic:tip,x=3").quantities["distance"] == "tip"


def test_a_touch_sensor_is_where_nothing_is_said():
    orders = read_sensors(["in2=gyro", "in4=none"])
    assert [orders[port].kind for port in ("in1", "in2", "in3", "in4")] == [
        "touch", "gyro", "touch", "none",
    ]  # fmt: skip


def test_values_from_a_file(csv):
    file = csv("0,10\n2,30\n\n4,20\n")
    wanted = [10, 20, 30, 25, 20]
    assert values(f"in1=ultrasonic:{file}", "distance", 0, 1, 2, 3, 99) == pytest.approx(wanted)
    assert values(f"in1=ultrasonic,distance={file}", "distance", 1) == [20]
    assert values(f"in1=ultrasonic:distance={file},x=3", "distance", 1) == [20]
    assert values(f"in1=infrared:2.beacon={file}", "2.beacon", 4) == [20]
    named = csv("time,distance\n1,10\n2,30\n")
    assert values(f"in1=ultrasonic:{named}", "distance", 0, 1.5, 3) == [10, 20, 30]


def test_a_file_gives_what_its_columns_are_named(csv):
    file = csv("time,surface,ambient,note\n0,white,5,a\n2,black,15,b\n", "t.CSV")
    order = read_sensor(f"in1=color:{file},red=4")
    assert set(order.quantities) == {"surface", "ambient", "red"}
    assert [order.quantities["surface"].value(t) for t in (0, 1.9, 2)] == [
        "white", "white", "black",
    ]  # fmt: skip
    assert order.quantities["ambient"].value(1) == 10


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("in5=gyro", ["in5=gyro", "in1 to in4", "ultrasonic"]),
        ("gyro", ["PORT=KIND"]),
        ("in1=sonar", ["in1=sonar", "ultrasonic"]),
        ("in1=gyro;3", ["PORT=KIND"]),
        ("in1=none:3", ["none takes no values"]),
        ("in1=ultrasonic:", ["no value behind the colon"]),
        ("in1=ultrasonic:-3", ["distance = -3", "0 to 1000 cm"]),
        ("in1=ultrasonic:nan", ["distance = nan"]),
        ("in1=ultrasonic:1e9", ["1e9", "1000"]),
        ("in1=ultrasonic:12..80", ["12..80", "LOW..HIGH/SECONDSs"]),
        ("in1=ultrasonic:12..2000/5s", ["2000"]),
        ("in1=ultrasonic:12..80/0s", ["more than 0 s"]),
        ("in1=ultrasonic:12..80/xs", ["'x'", "time"]),
        ("in1=ultrasonic:1:2", ["VALUE@SECONDS"]),
        ("in1=ultrasonic:1@3", ["VALUE@SECONDS"]),
        ("in1=ultrasonic:1:2@5:3@4", ["in order"]),
        ("in1=ultrasonic:1:2@inf", ["'inf'"]),
        ("in1=ultrasonic:1,colour=3", ["no quantity 'colour'", "distance"]),
        ("in1=ultrasonic:1,heard", ["heard=VALUES"]),
        ("in1=ultrasonic:1,distance=3", ["distance is given twice"]),
        ("in1=ultrasonic:1,noise=1..2/3s", ["does not change"]),
        ("in1=gyro:9,flipped=0:1@2", ["flipped", "does not change"]),
        ("in1=gyro:9,flipped=2", ["flipped", "2"]),
        ("in1=ultrasonic:tipp", ["tipp", "number"]),
        ("in1=touch:0..1/3s", ["jumps"]),
        ("in1=color:white,reflect=30", ["surface and reflect", "give one of them"]),
        ("in1=color:line,surface=red", ["surface and reflect", "give one of them"]),
        ("in1=touch:0.5", ["whole number"]),
        ("in1=color:mauve", ["mauve", "one of none, black"]),
        ("in1=infrared,5.heading=3", ["5", "1, 2, 3, 4"]),
        ("in1=infrared,2.distance=3", ["all", "distance=VALUES"]),
        ("in1=infrared,buttons=top", ["top", "top_left"]),
        ("in1=ultrasonic:nowhere.csv", ["nowhere.csv", "No such file"]),
        ("in1=\x1b[3m", ["PORT=KIND"]),
    ],
)
def test_a_bad_sensor_is_refused_in_one_line(text, says):
    with pytest.raises(BadSensor) as refused:
        read_sensor(text)
    message = str(refused.value)
    assert "\n" not in message
    assert "\x1b" not in message
    for word in says:
        assert word in message


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", ["no line of time,value"]),
        ("time,distance\n", ["no line of time,value"]),
        ("0,1\n1\n", ["line 2", "'1'"]),
        ("0,1\n0,2\n", ["line 2", "later"]),
        ("0,1\nx,2\n", ["line 2"]),
        ("0,1\n1,-4\n", ["distance = -4", "1000"]),
        ("0,1\n1,nan\n", ["nan"]),
    ],
)
def test_a_bad_file_is_refused_in_one_line(csv, text, says):
    with pytest.raises(BadSensor) as refused:
        read_sensor(f"in1=ultrasonic:{csv(text)}")
    message = str(refused.value)
    assert "\n" not in message
    for word in says:
        assert word in message


def test_what_is_no_text_is_refused(tmp_path):
    file = tmp_path / "a.csv"
    file.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(BadSensor, match="is not a text"):
        read_sensor(f"in1=sound:{file}")


def test_one_input_takes_one_sensor():
    with pytest.raises(BadSensor, match="in2 has one already, 'in2=gyro'"):
        read_sensors(["in2=gyro", "in2=touch"])

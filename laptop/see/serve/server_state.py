"""The state of the link to the brick, for display."""

from __future__ import annotations

from dataclasses import dataclass, field

from shared.job_messages import JobStatus
from shared.messages import Status


@dataclass(frozen=True)
class ServerState:
    """State of the link.

    Attributes:
        client: address of the brick that is served, or None.
        since: when it was let in, s on the server's clock.
        status: its last Status, or None.
        status_age: s since that came in.
        round_trip: the least of the last pings, s; it includes the wait until the brick's program
            looks.
        refusal: the last one, with its sender; "" if there was none since a brick was let in.
        lost: why the last brick left; "" if none did.
        counters: of the present link, see shared.link.Link; {} without one.
        progress: the brick's last JobStatus on this link with a job, or None.
        progress_age: s since that was true.
        status_lag: s that the status had been on its way when it came in, as far as known.
    """

    client: str | None = None
    since: float | None = None
    status: Status | None = None
    status_age: float | None = None
    round_trip: float | None = None
    refusal: str = ""
    lost: str = ""
    counters: dict[str, int] = field(default_factory=dict)
    progress: JobStatus | None = None
    progress_age: float | None = None
    status_lag: float = 0.0

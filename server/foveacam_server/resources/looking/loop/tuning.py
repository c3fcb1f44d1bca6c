"""Tunes the running loop as a job that can be cancelled; holds the result of the last tuning."""

from collections.abc import Callable
from concurrent.futures import Future

from foveacam_hardware.contract import Busy
from foveacam_pipeline.continuous_loop.autotune import TuneResult
from foveacam_pipeline.continuous_loop.pictures import tune_picture
from foveacam_pipeline.continuous_loop.settings import LoopSettings
from foveacam_server.foundation.errors import NotFound
from foveacam_server.foundation.events import EventLog
from foveacam_server.foundation.job_table import Job
from foveacam_server.foundation.jobs import JobContext, JobRunner
from foveacam_server.foundation.names import utc_now
from foveacam_server.resources.looking.loop.documents import TunedLoop
from foveacam_server.resources.looking.loop.loop_run import LoopRun, TuneOrder
from foveacam_server.resources.looking.loop.schema import LoopTuned, LoopTuneRequest

KIND = "loop_tune"
URL = "/api/v1/loop"


class LoopTuning:
    """Tunes one loop at a time; callable from any thread."""

    def __init__(
        self,
        *,
        jobs: JobRunner,
        events: EventLog,
        run: Callable[[], LoopRun],
        keep: Callable[[LoopSettings], None],
    ) -> None:
        """`run`: returns the running loop or raises `Busy`; `keep`: stores tuned gains."""
        self._jobs = jobs
        self._events = events
        self._run = run
        self._keep = keep
        self.last: TunedLoop | None = None
        """The last successful tuning."""
        jobs.handle(KIND, self._work, parallel=True)

    def start(self, request: LoopTuneRequest, *, idempotency_key: str | None = None) -> Job:
        """Queue a tuning; raise `Busy` while the loop does not run, is being tuned, or has its eyes split."""
        run = self._run()
        check_not_tuned(run)
        if run.split is not None:
            raise Busy(
                "each eye follows a place of its own",
                found="eyes apart",
                remedy="unite them first: DELETE /api/v1/loop/eyes",
            )
        return self._jobs.submit(KIND, request, idempotency_key=idempotency_key)

    def picture(self, *, form: str) -> bytes:
        """Return the step responses before and after the last tuning, png or svg, or raise `NotFound`."""
        if self.last is None:
            raise NotFound("the loop was not tuned yet", asked="a tuning's picture")
        return tune_picture(self.last.result, form=form)

    def _work(self, context: JobContext) -> str:
        done = Future[TuneResult]()
        request = context.job.parse_request(LoopTuneRequest)
        self._run().tune(TuneOrder(request=request, context=context, done=done))
        result = done.result()
        self._keep(result.settings)
        self.last = TunedLoop(result=result, tuned_utc=utc_now())
        self._events.emit(
            "loop.tuned",
            f"the loop was tuned: the cost of a step went from {result.cost_before:.2f} to {result.cost:.2f}",
            data=LoopTuned(cost_before=result.cost_before, cost=result.cost),
        )
        return URL


def check_not_tuned(run: LoopRun) -> None:
    """Raise `Busy` while the loop is being tuned."""
    if run.tune_job_id is not None:
        raise Busy(
            "the loop is being tuned",
            found=f"job {run.tune_job_id}",
            remedy="wait until the tuning has ended, or cancel it",
        )

"""Draws how the tuned axes answer a step, before and after tuning."""

import io

from foveacam_pipeline.loop.autotune import TuneResult
from foveacam_pipeline.loop.settings import Axis
from foveacam_pipeline.loop.step_response import SETTLED_SHARE, StepResponse

NAMES = {Axis.PAN_X: "pan", Axis.VERGE: "vergence", Axis.SHIFT_Y: "vertical shift"}
DPI = 110


def tune_picture(result: TuneResult, *, form: str = "png") -> bytes:
    """Return the steps of every loop before and after as a picture; `form`: png or svg."""
    from matplotlib.figure import Figure  # loads for seconds

    figure = Figure(figsize=(10.5, 3.4), dpi=DPI, layout="constrained")
    for axes, (axis, after) in zip(figure.subplots(1, len(result.after)), result.after.items(), strict=True):
        for response, name, colour in (
            (result.before[axis], "before", "#888888"),
            (after, "tuned", "#d95f02"),
        ):
            label = f"{name}: {_settled(response)}"
            axes.plot(1e3 * response.t_s, 100.0 * response.share, "o-", color=colour, ms=3.5, label=label)
        axes.axhspan(100.0 * (1.0 - SETTLED_SHARE), 100.0 * (1.0 + SETTLED_SHARE), color="0.5", alpha=0.2)
        axes.set_title(NAMES.get(axis, axis.value), fontsize=10)
        axes.set_xlabel("after the step, ms")
        axes.grid(visible=True, alpha=0.3)
        axes.legend(fontsize=8, loc="lower right")
    figure.axes[0].set_ylabel("of the step, %")
    buffer = io.BytesIO()
    figure.savefig(buffer, format=form)
    return buffer.getvalue()


def _settled(response: StepResponse) -> str:
    settle_s = response.settle_s
    overshoot = f"overshoot {100.0 * response.overshoot:.0f} %"
    return f"not settled, {overshoot}" if settle_s is None else f"{1e3 * settle_s:.0f} ms, {overshoot}"

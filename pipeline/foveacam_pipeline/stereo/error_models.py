"""The fitted weights of the error model, one set for each matcher; `errors` names the data."""

from foveacam_pipeline.stereo.errors import FULL_SIZE, HALF_SIZE, CueWeights, ErrorModel

SEMI_GLOBAL = ErrorModel(
    windows=FULL_SIZE,
    log_sigma=CueWeights(
        constant=-0.858,
        noise_sigma=0.257,
        noise=0.223,
        step=0.028,
        spread=0.646,
        wide_spread=0.017,
        holes=1.884,
        wide_holes=-0.185,
        likeness=0.050,
    ),
    log_odds_wrong=CueWeights(
        constant=-3.041,
        noise_sigma=0.039,
        noise=0.742,
        step=0.149,
        spread=0.780,
        wide_spread=0.272,
        holes=0.393,
        wide_holes=1.259,
        likeness=-0.665,
    ),
)
"""Of `match`."""
LIVE = ErrorModel(
    windows=HALF_SIZE,
    log_sigma=CueWeights(
        constant=-0.181,
        noise_sigma=0.264,
        noise=0.335,
        step=0.271,
        spread=0.295,
        wide_spread=0.068,
        holes=0.544,
        wide_holes=0.311,
        likeness=-0.272,
    ),
    log_odds_wrong=CueWeights(
        constant=-1.028,
        noise_sigma=-0.072,
        noise=0.659,
        step=0.302,
        spread=0.359,
        wide_spread=0.407,
        holes=0.048,
        wide_holes=3.371,
        likeness=-2.433,
    ),
)
"""Of `live`."""

"""What ``predict --json`` prints."""

from wirebayes.result_warnings import Warned


class PredictionJson(Warned):
    """What was predicted; `readings` has a row for each row of the protocol, by the header of the table."""

    experiment: str
    prediction: str
    seed: int
    readings: list[dict[str, float]]

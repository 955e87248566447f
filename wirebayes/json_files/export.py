"""What `export` prints with ``--json``; the creep table is ``creep-table.csv``."""

from wirebayes.result_warnings import Warned


class ExportSummary(Warned):
    """Names of the files, and the creep table's rows by its header, `wire` where there are several."""

    files: list[str]
    creep_table: list[dict[str, float | str]]

"""The ways to tell when photographs were taken; apart, so that `--help` need not wait."""

from enum import StrEnum


class TimeRule(StrEnum):
    """Which of a file's ways to tell its moment counts."""

    AUTO = "auto"  # EXIF, else the name
    EXIF = "exif"
    FILE_NAME = "file_name"
    CSV = "csv"
    FILE_TIME = "file_time"

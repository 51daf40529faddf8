"""Detectors: what other features, the worker and the command line may ask for."""

import hashlib

PROBE_JOB = "probe_model"
IMPORTED_FAMILY = "imported"
# Imported boxes have no settings of ours: one constant stands for "as they came".
IMPORTED_SETTINGS_SHA256 = hashlib.sha256(b"imported").hexdigest()

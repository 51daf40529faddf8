"""Training of the demo harbour's detector, from rendered scenes and from nothing else.

Four steps, each a program of its own (`python -m tools.train_harbour_detector.STEP --help`):
`render` makes scenes with their truth, `train` fits a YOLOX-Nano to them from random weights,
`export` writes it as ONNX, and `evaluate` measures the ONNX file through Quaymark's own path on
seeds and hulls that were never seen. The model card app/simulation/harbour_yolox_nano.md has the
command lines and the figures.
"""

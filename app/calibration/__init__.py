"""Chequerboard calibration: photographs of a board, the lens they tell, and its versions."""

"""How far the clocks of cameras are off: by a person's word, or told from vessels."""

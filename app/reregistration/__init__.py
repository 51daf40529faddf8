"""Where a camera looks now, told from photographs: jobs, the pointings they propose, decisions."""

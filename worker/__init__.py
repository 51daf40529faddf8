"""The worker process: takes jobs from the database and does them; never imported by the web."""

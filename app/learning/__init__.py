"""Learning from reviews: a site's graded images tell its next runs what is probable there."""

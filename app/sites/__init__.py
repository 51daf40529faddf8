"""Sites and their cameras: the places everything else hangs on."""

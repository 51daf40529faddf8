"""How long things are kept: rules of sites and cameras, tried before they are switched on."""

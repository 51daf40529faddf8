"""Webhooks: a site's finished runs and exports, told to an address outside."""

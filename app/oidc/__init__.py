"""The feature of signing in at an identity provider (OpenID Connect)."""

"""The feature of people, tokens and the audit log, for administrators."""

"""Writers: one pure module a format, from records to bytes."""

"""What programs elsewhere import of Quaymark: its client. The server itself is `app`."""

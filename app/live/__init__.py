"""What goes on by itself: folders that are watched, photographs dropped, standing runs."""

"""The wind behind a load: the most likely profile that makes it, its band, and random profiles given the load."""

"""The mean flight: the ascent without wind, integrated with located events."""

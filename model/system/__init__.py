"""The general linear time-varying system, and its symbols."""

"""The pace of the whole: seconds from a click to an answer, and what each part of it costs."""

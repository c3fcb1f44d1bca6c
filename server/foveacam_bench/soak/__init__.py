"""A day of use in virtual time, then many clients at once: does the server stay as it was?"""

"""What the operator corrects of a fixation's answer."""

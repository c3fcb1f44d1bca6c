"""The vergence loop: correction of steps, tuning, and prediction of moving targets."""

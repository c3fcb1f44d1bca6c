"""The paper's analyses (Sec. 4), one folder a subject: the formulas, the studies and the checks on both."""

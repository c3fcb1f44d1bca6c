"""The paper's analyses (Sec. 4), one module a subsection: formulas and what checks them."""

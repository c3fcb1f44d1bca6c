"""The mirror controller behind the contract, and the guardian that parks the mirrors of a killed host."""

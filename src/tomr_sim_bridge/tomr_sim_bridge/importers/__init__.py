"""Foreign data sets turned into recordings of the contract's form."""

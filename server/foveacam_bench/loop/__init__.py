"""How well the vergence loop corrects, is tuned, and leads a target that moves."""

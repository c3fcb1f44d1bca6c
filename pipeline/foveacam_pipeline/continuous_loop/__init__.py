"""The vergence loop: a look after another corrects pan, vergence and vertical shift, with gains to tune."""

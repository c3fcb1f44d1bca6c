"""The vergence loop: feedback control of pan, vergence and vertical shift, with tunable gains."""

"""What every study returns, the cache of results, and the HTML report."""

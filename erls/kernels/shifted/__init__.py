"""(M + α C + β K) x = b for a long chain, link by link: the iteration matrices of implicit integrators."""

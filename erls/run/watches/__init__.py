"""What looks at a run before, while and after it is computed: `base` has the contract, `registry` all of them."""

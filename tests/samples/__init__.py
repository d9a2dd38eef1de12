"""Problems, measurements and faults with a known truth, which tests and measured claims share."""

"""What a measured channel is, and how channels become a virtual point. May import `physics`."""

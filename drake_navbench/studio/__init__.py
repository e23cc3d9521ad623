"""The studio: pages to draw scenarios, change parameters, drive trials and look at them."""

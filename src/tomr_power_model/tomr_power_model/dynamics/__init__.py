"""One dynamics of a wheeled robot: body, wheels, contacts, motors, drivers and supply."""

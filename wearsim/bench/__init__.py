"""Speed against error: what every model, stepper and plan costs, and how near it comes.

`exact` holds solutions of the exact theory; a topic measures one thing (`Topic`), and says nothing
of how it is shown.
"""

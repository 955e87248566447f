"""Which page shows a command's results: a new command with results adds its own here."""

# each module has ``page(folder, configuration)``
PAGES = {
    "reproduce": "wirebayes.paper.page",
    "import": "wirebayes.report.pages.check",
    "check": "wirebayes.report.pages.check",
    "fit": "wirebayes.report.pages.fit",
    "batch": "wirebayes.report.pages.batch",
    "compare": "wirebayes.report.pages.compare",
    "discover": "wirebayes.report.pages.discover",
    "plan": "wirebayes.report.pages.plan",
    "pose": "wirebayes.report.pages.pose",
    "calibrate": "wirebayes.report.pages.calibrate",
    "export": "wirebayes.report.pages.export",
    "simulate": "wirebayes.report.pages.simulate",
}

"""Which page shows a command's results: a new command with results adds its own here."""

# the module, and its function of the folder and the configuration
PAGES = {
    "reproduce": "wirebayes.paper.page:paper_page",
    "import": "wirebayes.report.pages.check:check_page",
    "check": "wirebayes.report.pages.check:check_page",
    "fit": "wirebayes.report.pages.fit:fit_page",
    "batch": "wirebayes.report.pages.batch:batch_page",
    "compare": "wirebayes.report.pages.compare:compare_page",
    "discover": "wirebayes.report.pages.discover:discover_page",
    "plan": "wirebayes.report.pages.plan:plan_page",
    "pose": "wirebayes.report.pages.pose:pose_page",
    "calibrate": "wirebayes.report.pages.calibrate:calibrate_page",
    "export": "wirebayes.report.pages.export:export_page",
    "simulate": "wirebayes.report.pages.simulate:simulate_page",
}

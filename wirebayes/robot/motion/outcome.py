"""How the search for an equilibrium ends."""

FOUND, NOT_CONVERGED, NO_EQUILIBRIUM, NOT_HELD, FELL = 0, 1, 2, 3, 4
STATUS = {
    FOUND: "stable equilibrium",
    NOT_CONVERGED: "not converged",
    NO_EQUILIBRIUM: "no equilibrium: the wires cannot carry the platform",
    NOT_HELD: "in balance, but free to move or about to fall: no isolated stable pose",
    FELL: "fell: the equilibrium that was followed lost its stability",
}

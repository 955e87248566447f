"""wirebayes and every peer on one posterior, beside one another."""

import jax.numpy as jnp
import numpy as np

from analyses.benchmarks import gradient, measure, model, plain
from wirebayes.io.paper import experiments
from wirebayes.model.build import build
from wirebayes.model.spec import ModelSpec

PEERS = {
    "NumPyro NUTS, natural": lambda p, s, t: gradient.numpyro_nuts(p, s, t, True),
    "NumPyro NUTS, our coordinates": lambda p, s, t: gradient.numpyro_nuts(p, s, t, False),
    "compiled NUTS, natural": lambda p, s, t: gradient.blackjax_nuts(p, s, t, True),
    "compiled NUTS, our coordinates": lambda p, s, t: gradient.blackjax_nuts(p, s, t, False),
    "ChEES-HMC, natural": lambda p, s, t: gradient.chees(p, s, t, True),
    "ChEES-HMC, our coordinates": lambda p, s, t: gradient.chees(p, s, t, False),
    "emcee stretch, natural": lambda p, s, t: plain.stretch(p, s, t, True),
    "emcee stretch, our coordinates": lambda p, s, t: plain.stretch(p, s, t, False),
    "dynesty, unit cube": plain.dynesty_run,
    "dynesty with random walks, unit cube": lambda p, s, t: plain.dynesty_run(p, s, t, "rwalk"),
    "nutpie, natural": lambda p, s, t: gradient.nutpie_run(p, s, t, True),
    "nutpie, our coordinates": lambda p, s, t: gradient.nutpie_run(p, s, t, False),
}


def beside_each_peer(wire, likelihood, options):
    """Every wanted peer on the posterior of a wire, and wirebayes beside each."""
    (experiment,) = [one for one in experiments() if one.name == wire]
    problem = build([experiment], spec=ModelSpec(likelihood=likelihood))
    # in a test's own units the priors of B and k2 depend on no exponent: independent priors, as the peers have them
    problem = problem.in_units(problem.own_units)
    difference = model.difference(jnp, problem, options.seed)
    print(f"\n{wire}, {likelihood}: log density differs from the peers' by {difference:.1e} at most", flush=True)
    if difference > 1e-8:
        if not model.may_be_slack(problem, options.seed):
            raise SystemExit("the peers' model is not the package's")
        print("  left out: a setting error may leave this wire slack, which the peers' model does not know")
        return None
    out = {"case": f"{wire}, {likelihood}", "log_density_difference": difference, "ours": [], "peers": {}}
    print(f"  {'':36s} {'all costs':>10s} {'sampling':>10s} {'ratio':>8s}  effective draws per processor second")
    for name, peer in PEERS.items():
        if options.peers and not any(name.startswith(word) for word in options.peers):
            continue
        mine, reference = plain.ours(problem, options.seed, 0.0)
        out["ours"].append(mine)
        try:
            theirs, values = peer(problem, options.seed, 60.0 * options.minutes)
        except Exception as error:  # a peer that cannot run is told, and the others go on
            theirs = {"converged": False, "why": f"{type(error).__name__}: {error}"[:300]}
        else:
            theirs["agreement"] = measure.agreement(values, reference)
            if theirs["converged"]:
                for kind in ("all_costs_per_cpu_s", "all_costs_per_wall_s", "sampling_per_cpu_s"):
                    key = {
                        "all_costs_per_cpu_s": "ratio_all_costs_cpu",
                        "all_costs_per_wall_s": "ratio_all_costs_wall",
                        "sampling_per_cpu_s": "ratio_sampling_cpu",
                    }[kind]
                    theirs[key] = mine[kind] / theirs[kind]
        out["peers"][name] = theirs
        _tell(name, theirs)
    _tell(
        "wirebayes (median)",
        {
            k: float(np.median([m[k] for m in out["ours"]]))
            for k in ("all_costs_per_cpu_s", "sampling_per_cpu_s", "ess_per_kept_evaluation", "ess_per_evaluation")
        }
        | {"converged": all(m["converged"] for m in out["ours"])},
    )
    return out


def _tell(name, r):
    if "why" in r:
        line = f"could not be run: {r['why']}"
    else:
        line = f"{r['all_costs_per_cpu_s']:10.1f} {r['sampling_per_cpu_s']:10.1f}"
        line += f" {r['ratio_all_costs_cpu']:8.1f}" if "ratio_all_costs_cpu" in r else " " * 9
        if "agreement" in r:
            line += f"  mean off {r['agreement']['mean_in_sd']:.3f} sd, log sd off {r['agreement']['log_sd']:.3f}"
        if "ess_per_evaluation" in r:
            line += f"  ESS per evaluation {r['ess_per_kept_evaluation']:.3f},"
            line += f" burn-in counted {r['ess_per_evaluation']:.3f}"
        if not r["converged"]:
            line = (
                f"not converged (divergences {r.get('divergences')}, R-hat {r.get('r_hat')}, ESS {r.get('ess', 0):.0f})"
            )
    print(f"  {name:36s} {line}", flush=True)

# %% [markdown]
# # The solver in process
# A model is read once; parameters and effects change in memory; states are saved, restored and set; short windows run in batch over
# threads; channels come back as arrays. Run the cells in Jupyter (or VS Code), or the file as a whole:
# `python examples/in_process/notebook.py rover.db`, after `make demo` with out/demo/rover.db.

# %% A model and a run
import sys

import numpy as np
from rille._solver import Model, Simulation, windows

from rille import simulate, store
from rille.model import Effect

model = Model(sys.argv[1] if len(sys.argv) > 1 and sys.argv[1].endswith(".db") else "out/demo/rover.db")
simulation = Simulation(model)
simulation.settle()
wheel, body = simulation.wheel_names[0], simulation.body_names[0]
channels = [("wheel.slip_ratio", wheel, 0), ("wheel.sinkage", wheel, 0), ("part.position", body, 0)]
trace = simulation.sample(8000, 100, channels)  # 8000 steps, a row every 100
print(f"{simulation.time:.1f} s simulated; slip ratio of {wheel} at the end: {trace[-1, 0]:.3f}, sinkage {1e3 * trace[-1, 1]:.1f} mm")

# %% Save, try something, restore: bit by bit the same
state = simulation.save()
ahead = simulation.sample(1000, 100, channels)
simulation.restore(state)
assert np.array_equal(simulation.sample(1000, 100, channels), ahead)
simulation.restore(state)

# %% A parameter and an effect, without reading the database again
soil = next(name for name in model.parameters() if name.endswith(".friction_angle"))
softer = model.copy()
softer.set(soil, 0.8 * model.get(soil))
digging = model.copy()
digging.set_effects(simulate.effect_rows([Effect(kind="slip_sinkage", parameters={"slip_gain": 0.5})], store.effect_kinds()))

# %% Windows in batch: 3 models x 4 starts, over all cores
starts = []
for _ in range(4):
    simulation.step(500)
    starts.append(simulation.motion()[0])
motions = np.array(starts)
answers = windows([model, softer, digging], motions, n_steps=1000, every=100, channels=channels)
print(f"windows: shape {answers.shape} = models, starts, samples, channels")
for name, rows in zip(("as it is", "0.8 of the friction angle", "with slip-sinkage"), answers, strict=True):
    print(f"  {name:26s} slip ratio {rows[:, -1, 0].mean():.3f}   sinkage {1e3 * rows[:, -1, 1].mean():.1f} mm")

# %% Sensitivities: how the channels answer to parameters, by central differences
parameters = {soil: 1e-3, soil.replace("friction_angle", "cohesion"): 1.0, f"body.{body}.mass": 0.1}
slopes = simulate.sensitivities(model, parameters, motions, n_steps=1000, every=1000, channels=channels)
for name, rows in zip(parameters, slopes, strict=True):
    print(f"  d sinkage / d {name:40s} {1e3 * rows[:, -1, 1].mean():+.3g} mm per unit")

# %% Forces, energies
print(f"energy: {simulation.energy_balance()}")
print(f"largest reaction of a joint: {np.linalg.norm(simulation.reactions()[:, :3], axis=1).max():.1f} N")

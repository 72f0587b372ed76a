"""Who gets the fan? An arbiter for a building's ventilation, in cells.

`python examples/ventilation.py` prints what it finds, and writes ventilation.png and ventilation.toml here. So does
running it cell by cell; importing it does neither.
"""

# %% [markdown]
# # Who gets the fan?
#
# A ventilation plant has one fan and three reasons to use it, in this order: *smoke* must leave the building, stale
# *air* must be replaced, a warm *room* should be cooled. A caretaker would not switch between the three at sharp
# limits; the more it smells of fire, the less the temperature matters. That is what an arbiter of prioritized
# criteria does.

# %%
import numpy as np
from matplotlib.figure import Figure

from fuzzy_arbiter import Arbiter, Output, Rule, System, Variable, falling, pictures, rising, trapezoid, triangle
from fuzzy_arbiter.criteria import Criterion

# %% [markdown]
# ## From measurements to weights
#
# A criterion is a measurement and the degree to which it asks for attention: below the first number not at all, above
# the second fully. The command is the priority. Sensors may read more than the second number; `outside="clip"` says
# that this is no fault, but as good as the end.

# %%
SMOKE = Criterion("smoke", on="present", off="absent", membership=rising(0.5, 3.0))  # obscuration [%/m]
AIR = Criterion("co2", on="stale", off="fresh", membership=rising(800.0, 1400.0))  # carbon dioxide [ppm]
ROOM = Criterion("temperature", on="hot", off="mild", membership=rising(24.0, 28.0))  # [deg C]

arbiter = Arbiter([SMOKE, AIR, ROOM], outside="clip")

afternoon = {"smoke": 0.1, "co2": 950.0, "temperature": 27.0}
weights = arbiter(afternoon)
if __name__ == "__main__":
    print("afternoon:", ", ".join(f"{name} {weight:.3f}" for name, weight in weights._asdict().items()))

# %% [markdown]
# The air is stale to the degree (950 - 800) / 600 = 0.25, so that the room, hot to the degree 0.75, has most of the
# say, and keeps as much of it as the air does not want. The rules can say so themselves:

# %%
explanation = arbiter.explain(afternoon)
if __name__ == "__main__":
    print(explanation)

# %% [markdown]
# ## Can the rules be trusted?
#
# Before anything is switched: is there, wherever the sensors stand, a rule for each weight, and never two that
# contradict each other? `verify` proves it instead of trying some places.

# %%
verification = arbiter.verify()
if __name__ == "__main__":
    print(verification)

# %% [markdown]
# ## A day
#
# One sample a minute: people come at eight and leave at five, the sun comes in the afternoon, and at ten past two
# somebody burns a toast. A batch takes the whole day at once.

# %%
minutes = np.arange(24 * 60)
hour = minutes / 60.0
noise = np.random.default_rng(7).normal(size=(3, len(minutes)))
people = np.clip(np.minimum(hour - 8.0, 17.0 - hour), 0.0, 1.0)
toast = np.where(minutes < 850, 0.0, np.exp(-(minutes - 850) / 12.0))

day = np.column_stack(
    [
        np.clip(4.0 * toast + 0.05 * noise[0], 0.0, None),
        420.0 + 800.0 * people + 5.0 * noise[1],
        21.0 + 6.0 * np.exp(-(((hour - 15.0) / 3.0) ** 2)) + 0.1 * noise[2],
    ]
)
day_weights = arbiter.batch(day)
leader = np.where(day_weights.max(axis=1) > 0.0, day_weights.argmax(axis=1), -1)
if __name__ == "__main__":
    for k, name in enumerate(("smoke", "air", "room")):
        print(f"{name} leads for {np.count_nonzero(leader == k)} minutes")

# %% [markdown]
# ## Pictures
#
# Every picture draws on axes of one's own, here beside the day's weights: without smoke, who decides at which carbon
# dioxide and temperature?

# %%
figure = Figure(figsize=(11.0, 4.2), layout="constrained")
left, right = figure.subplots(1, 2)
for k, (name, line) in enumerate((("smoke", "-"), ("air", "--"), ("room", ":"))):
    left.plot(hour, day_weights[:, k], line, color=pictures.COLORS[k], label=name)
left.set(xlim=(6.0, 20.0), ylim=(0.0, 1.0), xlabel="hour of the day", ylabel="weight")
left.legend(loc="upper right", frameon=False)
pictures.decisions(arbiter, ("co2", "temperature"), {"smoke": 0.5}, ax=right)
if __name__ == "__main__":
    figure.savefig("ventilation.png", dpi=100)

# %% [markdown]
# ## Keep it
#
# The definition is a file, for others to read, to change, and to put under version control. What comes back is equal.

# %%
if __name__ == "__main__":
    arbiter.save("ventilation.toml")
    assert Arbiter.load("ventilation.toml") == arbiter

# %% [markdown]
# ## Rules of one's own
#
# Criteria make their rules themselves. Any other Mamdani system can be written down by hand: as text, or with `&`,
# `|` and `~` on the variables' terms. This one gives the speed of the fan. Its last rule is a wish, not a command, and
# so has a weight; `default` says what happens where no rule fires.

# %%
smoke, co2, temperature = SMOKE.variable, AIR.variable, ROOM.variable
outdoors = Variable("outdoors", (-20.0, 40.0), {"cold": falling(0.0, 10.0), "warm": rising(20.0, 30.0)})
fan = Output(
    "fan",
    (0.0, 100.0),  # [%]
    {"slow": triangle(0, 20, 40), "half": triangle(30, 50, 70), "full": trapezoid(60, 90, 100, 100)},
    default=20.0,
)
speed = Arbiter(
    system=System(
        inputs=(smoke, co2, temperature, outdoors),
        outputs=(fan,),
        rules=(
            Rule(smoke["present"], fan["full"]),
            Rule(~smoke["present"] & co2["stale"], fan["half"]),
            Rule(~smoke["present"] & co2["fresh"] & temperature["mild"], fan["slow"]),
            "if temperature is hot and not (outdoors is warm or outdoors is cold) then fan is full with 0.6",
        ),
        name="fan",
        outside="clip",
    )
)
evening = {"smoke": 0.2, "co2": 1250.0, "temperature": 26.0, "outdoors": 15.0}
fan_speed = speed(evening)["fan"]
if __name__ == "__main__":
    print(f"evening: {fan_speed:.1f} % of the fan's speed, by the {speed.engine} engine")
    print(speed)

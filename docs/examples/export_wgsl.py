"""
Shader code, and what it costs
==============================

The model as a program in WGSL, generated from the functions that Python runs. Tables and solved lobes lie beside it as
textures.
"""

import re

import matplotlib.pyplot as plt

import velatura as vt

made = vt.export("varnished-paint", "wgsl", model="belcour2018")
print(f"{len(made.text.splitlines())} lines; beside them: {', '.join(made.beside)}")
for function in re.findall(r"^fn vt_(?:lobes|eval_pdf|sample)\(.*\) ->.*(?= \{)", made.text, re.MULTILINE):
    print(function)

# %%
# Operations of both functions that every shaded point calls, by model.

MODELS = ("velatura", "belcour2018", "weier2020", "bati2021", "yamaguchi2019", "realtime")
figure, ax = plt.subplots(figsize=(7, 3), layout="constrained")
start = [0] * len(MODELS)
for name in ("vt_lobes", "vt_eval_pdf"):
    costs = [vt.export("varnished-paint", "wgsl", model=model).costs[name] for model in MODELS]
    operations = [int(re.match(r"\d+", cost.replace(",", ""))[0]) for cost in costs]
    ax.barh(MODELS, operations, left=start, label=name)
    start = operations
ax.set(xlabel="operations", xscale="linear")
ax.invert_yaxis()
ax.legend()

# SPDX-License-Identifier: Apache-2.0
"""tests/readers/read_columns.py -- Gaussians as a Python package reads them: columns as of a 3DGS .ply, as JSON.

Usage: read_columns.py plyfile|gsply|usd-core|tinyusdz FILE. usd-core's validators also look the file over: what they say is the column "said".
"""
import ast
import json
import sys

import numpy


def columns_of(means, scales_log, quaternions, logits, harmonics):
    """harmonics: [count][functions][3]."""
    out = {f"{axis}": means[:, k] for k, axis in enumerate("xyz")}
    out.update({f"scale_{k}": scales_log[:, k] for k in range(3)})
    out.update({f"rot_{k}": quaternions[:, k] for k in range(4)})
    out["opacity"] = logits
    functions = harmonics.shape[1]
    for c in range(3):
        out[f"f_dc_{c}"] = harmonics[:, 0, c]
        out.update({f"f_rest_{c * (functions - 1) + k - 1}": harmonics[:, k, c] for k in range(1, functions)})
    return out


def by_plyfile(path):
    import plyfile

    vertices = plyfile.PlyData.read(path)["vertex"]
    return {p.name: vertices[p.name] for p in vertices.properties}


def by_gsply(path):
    import gsply

    read = gsply.read_spz(path) if path.endswith(".spz") else gsply.sogread(path) if path.endswith(".sog") else gsply.plyread(path)
    return columns_of(read.means, read.scales, read.quats, read.opacities, numpy.concatenate([read.sh0[:, None, :], read.shN], axis=1))


def of_usd(get, translate, turned):
    """USD's values as those of a .ply, whose axes the prim has. Opacities stay below 1 for the logit."""
    assert turned == 180
    opacity = numpy.clip(numpy.array(get("opacities"), float), 1e-7, 1 - 1e-7)
    functions = (get("radiance:sphericalHarmonicsDegree") + 1) ** 2
    return columns_of(numpy.array(get("positions"), float) + numpy.array(translate), numpy.log(numpy.array(get("scales"), float)), get("orientations"),
                      numpy.log(opacity / (1 - opacity)), numpy.array(get("radiance:sphericalHarmonicsCoefficients"), float).reshape(-1, functions, 3))


def by_usd_core(path):
    from pxr import Usd, UsdValidation, UsdVol

    stage = Usd.Stage.Open(path)
    prim = stage.GetDefaultPrim()
    assert prim.IsA(UsdVol.ParticleField3DGaussianSplat)

    def get(name):
        value = prim.GetAttribute(name).Get()
        return [(q.GetReal(), *q.GetImaginary()) for q in value] if name == "orientations" else value

    out = of_usd(lambda name: numpy.array(get(name)) if name == "orientations" else get(name), get("xformOp:translate"), get("xformOp:rotateZ"))
    validators = UsdValidation.ValidationRegistry().GetOrLoadAllValidators()
    assert len(validators) > 10
    errors = UsdValidation.ValidationContext(validators).Validate(stage)
    custom = [a.GetName() for a in prim.GetAttributes() if a.IsCustom()]
    out["said"] = [e.GetMessage() for e in errors] + [f"{name} is not of the schema" for name in custom]
    return out


def by_tinyusdz(path):
    import tinyusdz

    prim = next(iter(tinyusdz.traverse(tinyusdz.load(path))))

    def get(name):  # values of some types come as their text alone
        value = ast.literal_eval(prim.get_attribute(name).value.to_string())
        return numpy.array(value) if isinstance(value, list) else value

    return of_usd(get, get("xformOp:translate"), get("xformOp:rotateZ"))


readers = {"plyfile": by_plyfile, "gsply": by_gsply, "usd-core": by_usd_core, "tinyusdz": by_tinyusdz}
columns = readers[sys.argv[1]](sys.argv[2])
json.dump({name: values if name == "said" else numpy.asarray(values).astype(float).tolist() for name, values in columns.items()}, sys.stdout)

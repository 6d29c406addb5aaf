# SPDX-License-Identifier: Apache-2.0
"""tests/readers/read_ply.py -- a PLY as the package plyfile reads it: its columns as JSON. Usage: read_ply.py FILE"""
import json
import sys

import plyfile

vertices = plyfile.PlyData.read(sys.argv[1])["vertex"]
json.dump({p.name: vertices[p.name].astype(float).tolist() for p in vertices.properties}, sys.stdout)

# SPDX-License-Identifier: Apache-2.0
# tests/data/colmap4/make.py -- what made sparse/0 beside it: a rig of a panorama and a pinhole camera, with pycolmap 4.2.1, in this folder.
import os

import numpy as np
import pycolmap

r = pycolmap.Reconstruction()
cams=[pycolmap.Camera(model="EQUIRECTANGULAR", width=64, height=32, params=[64,32], camera_id=1), pycolmap.Camera(model="SIMPLE_PINHOLE", width=64, height=48, params=[50,32,24], camera_id=2)]
for c in cams: r.add_camera(c)
rig=pycolmap.Rig(rig_id=1)
rig.add_ref_sensor(cams[0].sensor_id)
rig.add_sensor(cams[1].sensor_id, pycolmap.Rigid3d(pycolmap.Rotation3d(np.array([0,0,0,1.])), np.array([0.1,0,0])))
r.add_rig(rig)
k=1
for f in range(1,4):
    fr=pycolmap.Frame(frame_id=f, rig_id=1)
    ims=[]
    for c in cams:
        im=pycolmap.Image(image_id=k, name="c%d/%d.png"%(c.camera_id,f), camera_id=c.camera_id, frame_id=f)
        im.points2D=pycolmap.Point2DList([pycolmap.Point2D(np.array([10.,10.]))])
        fr.add_data_id(im.data_id); ims.append(im); k+=1
    fr.rig_from_world=pycolmap.Rigid3d(pycolmap.Rotation3d(np.array([0,0,0,1.])), np.array([0.,0.,f]))
    r.add_frame(fr)
    for im in ims: r.add_image(im)
    r.register_frame(f)
r.add_point3D(np.array([0,0,5.]), pycolmap.Track([pycolmap.TrackElement(1,0),pycolmap.TrackElement(2,0)]), np.array([1,2,3],dtype=np.uint8))
os.makedirs("sparse/0",exist_ok=True)
r.write_binary("sparse/0")

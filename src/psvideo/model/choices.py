"""What may be chosen by name, each list once; on its own, so that a command's help loads nothing else."""

from collections.abc import Mapping
from typing import Literal

Solver = Literal["auto", "least-squares", "robust"]
"""How normals are solved. auto: robust from five lights on, which is when it has something to weigh."""
SplitMethod = Literal["weights", "hudon2015"]
"""How plates are rebuilt: by the rows' weights, or by Algorithm 1 of Hudon et al. 2015."""
Align = Literal["none", "flow", "auto"]
"""How the plates of a round are brought to one instant."""
Rate = Literal["round", "flash"]
"""Which instants are delivered: the middle of every round's flashes, or every flash."""
SpaceName = Literal["camera", "world", "tangent"]
"""The frame of the delivered normals."""
YDirection = Literal["up", "down"]
"""Which way the green channel points: up as in OpenGL, down as in DirectX."""
CameraTime = Literal["frames", "numbers", "seconds"]
"""How an animated camera's time codes count."""
MeshKind = Literal["ply", "usd"]
"""Kinds of files for the surface as a mesh."""
MapFiles = Literal["png16"]
"""Other encodings of the same maps."""
Preview = Literal["relit", "normals", "plates", "beauty"]
"""What a movie for eyes shows."""
PlatesPreview = Literal["plates", "beauty"]
"""What a movie of plates shows, where nothing is solved."""
Codec = Literal["vp9", "prores"]
"""How a movie is coded."""
MovieCodec = Literal["both", "vp9", "prores"]
"""How movies for eyes are coded; both: once for browsers and once for editing programs."""
CODECS: Mapping[MovieCodec, tuple[Codec, ...]] = {"both": ("vp9", "prores"), "vp9": ("vp9",), "prores": ("prores",)}
PREVIEWS: tuple[Preview, ...] = ("relit",)
"""The movies of a clip's results where nobody says otherwise."""
Compression = Literal["zip", "zips", "piz", "rle", "none"]
"""How pixels are packed, always without loss. ZIP is read everywhere; ZIPS (single lines) suits Nuke, RLE fast disks.
DWAA, DWAB and B44 lose data, and which they lose depends on the channels' names: they are not offered."""
USUAL_COMPRESSION: Compression = "zip"
"""How pixels are packed where nobody says otherwise: what every program reads."""
Program = Literal["nuke", "blender", "unreal", "houdini"]
"""The programs that a delivery can be made for."""
Prior = Literal["equal-lights", "equal-albedo"]
"""What a guessed rig takes for equal."""

NEAR_ITERATIONS = 1
"""How often near lights' surface is made again where nobody says otherwise: one leaves what the plane's distance
costs."""
MOST_ITERATIONS = 10
Pace = Literal["own", "fastest"]
"""How fast a finished clip is played: as it was filmed, or as fast as it is taken."""

"""Files of other people that `benchmarks/real_files.py` reads: where they come from, and what must come out.

None of them was made for this project. They are not part of it; the sources say where each may be had.
"""

from __future__ import annotations

from typing import NamedTuple


class Source(NamedTuple):
    """Where files come from. ``folder``: what they lie in below the folder that the benchmark is given."""

    folder: str
    place: str
    licence: str
    licence_file: str


SOURCES = {
    "ccx": Source("ccxtest", "Debian package calculix-ccx-test 2.11, its decks unpacked", "GPL-2+", "copyright"),
    "pynastran": Source("SteveDoyle2+pyNastran", "github.com/SteveDoyle2/pyNastran 1d25a92", "BSD-3", "LICENSE"),
    "pyyeti": Source("twmacro+pyyeti", "github.com/twmacro/pyyeti 034fb7b", "BSD-3", "LICENSE.txt"),
    "mapdl-archive": Source("akaszynski+mapdl-archive", "github.com/akaszynski/mapdl-archive", "MIT", "LICENSE"),
    "pymapdl-reader": Source("ansys+pymapdl-reader", "github.com/ansys/pymapdl-reader 0f74986", "MIT", "LICENSE"),
    "mfem": Source("mfem+data", "github.com/mfem/data f507846", "BSD-3 (of MFEM)", "-"),
    "libmesh": Source("libMesh+libmesh", "github.com/libMesh/libmesh 9076605", "LGPL-2.1", "COPYING"),
    "sfepy": Source("sfepy+sfepy", "github.com/sfepy/sfepy 3f01a19", "BSD-3", "LICENSE"),
    "elmer": Source("ElmerCSC+elmerfem", "github.com/ElmerCSC/elmerfem", "GPL-2+", "LICENSES"),
    "unv2ccx": Source("calculix+unv2ccx", "github.com/calculix/unv2ccx", "GPL-3", "LICENSE"),
    "example-data": Source("ansys+example-data", "github.com/ansys/example-data 246c578", "MIT", "LICENSE"),
    "vtk-data": Source("pyvista+vtk-data", "github.com/pyvista/vtk-data 126ee90", "Apache-2.0", "LICENSE"),
    "dealii": Source("dealii+dealii", "github.com/dealii/dealii 5820fa3", "Apache-2.0 or LGPL-2.1+", "LICENSE.md"),
    "seacas": Source("sandialabs+seacas", "github.com/sandialabs/seacas 7191793", "BSD-3", "LICENSE"),
    "exodus.jl": Source("cmhamel+Exodus.jl", "github.com/cmhamel/Exodus.jl 1f0b5f8", "MIT", "LICENSE.md"),
    "smesh": Source("SalomePlatform+smesh", "github.com/SalomePlatform/smesh c3bdf4f", "LGPL-2.1+", "COPYING"),
    "cae": Source("calculix+cae", "github.com/calculix/cae 8a7b525", "GPL-3", "LICENSE"),
    "aster": Source("ZOHAIUB+code_aster", "github.com/ZOHAIUB/code_aster (copy of code_aster)", "GPL-3", "LICENSE"),
    "abaqusreader": Source("JuliaFEM+AbaqusReader.jl", "github.com/JuliaFEM/AbaqusReader.jl", "MIT", "LICENSE.md"),
}


class Case(NamedTuple):
    """A file and what is expected of it.

    ``refused``: words of the error, empty for files that are read. ``beside``: what mass and frequencies are held
    against: ``deck``, CalculiX on the same text (element types put to those of equal formulation, one material, no
    supports, no steps); ``twin``, CalculiX on the deck that another program made of the same mesh; ``mesh``, CalculiX
    on the mesh as read here, which judges assembly and node order only; ``program``, what the program that made the
    file printed.
    """

    source: str
    path: str
    program: str
    beside: str = "mesh"
    refused: str = ""
    ignore: tuple[str, ...] = ()
    twin: str = ""
    length: str = "mm"


_SUPPORTS = ("BOUNDARY",)
_SPC = ("SPC1", "SPCADD")
_WORK, _TUREK = "pyansys-workflow/pymapdl-pydpf/", "pysystem-coupling/turek-horn-benchmark/"
_IOSS = "packages/seacas/libraries/ioss/src/main/test/"
_PADDER = "src/Tools/padder/resources/testdata/"
_CDB, _OP2 = "tests/test_data/", "pyNastran/op2/test/examples/"


def _decks(names: str, refused: str = "", ignore: tuple[str, ...] = _SUPPORTS) -> list[Case]:
    beside = "" if refused else "deck"
    return [Case("ccx", f"{n}.inp", "CalculiX deck", beside, refused, ignore) for n in names.split()]


CASES = [
    *_decks("beamp beamb beam8b beam8p beam10p achtelc segment1 capacitor c3d15 rotor aniso beamdy1"),
    *_decks("beamrb beamprb mpcforce beampdepmpc beamptied1"),
    *_decks("beamnlmpc", "resist rigid-body motion"),
    *_decks("achtel2", "pairs of nodes coincide"),
    *_decks("cube2", "no element face joins", ()),
    *_decks("contact1", "contact: 1 CONTACT PAIR"),
    *_decks("cou2d", "fluid", ()),
    *_decks("shell1", "1 SHELL SECTION"),
    Case("abaqusreader", "test/test_parse_mesh/beam.inp", "Abaqus deck"),
    Case("sfepy", "meshes/various_formats/abaqus_tet.inp", "Abaqus deck"),
    Case("pynastran", "models/solid_bending/solid_bending.bdf", "Nastran bulk (Patran)", ignore=_SPC),
    Case("pynastran", f"{_OP2}autodesk/aa8lzviq9.nas", "Nastran bulk (Autodesk)", ignore=("SPC1",)),
    Case("pynastran", "models/autodesk/nonlinear_beam.bdf", "Nastran bulk (Autodesk)", ignore=_SPC),
    Case("pynastran", "models/complex/tet10/Simple_Example.bdf", "Nastran bulk (Femap)", "", "", _SPC, length="in"),
    Case("pynastran", "models/nx/composite_solids/test.bdf", "Nastran bulk (NX)", ignore=("SPC",)),
    Case("pynastran", "models/other/see101nd.bdf", "Nastran bulk (MSC)", "", "BEGIN SUPER"),
    Case("pynastran", "models/plate/plate.bdf", "Nastran bulk", "", "shells: 25 CQUAD4", ("SPC1",)),
    Case("pynastran", "models/other/cqra00366.bdf", "Nastran bulk", "", "repeated"),
    Case("pymapdl-reader", "ansys/mapdl/reader/examples/HexBeam.cdb", "Ansys archive", "program", length="in"),
    Case("mapdl-archive", "src/mapdl_archive/examples/TetBeam.cdb", "Ansys archive"),
    Case("mapdl-archive", "src/mapdl_archive/examples/sector.cdb", "Ansys archive"),
    Case("mapdl-archive", "src/mapdl_archive/examples/academic_rotor.cdb", "Ansys archive"),
    Case("mapdl-archive", _CDB + "Beam_186TetQuadAnglesDOS.cdb", "Ansys archive"),
    Case("mapdl-archive", _CDB + "all_solid_cells.cdb", "Ansys archive", "", "no element face joins"),
    Case("mapdl-archive", _CDB + "hypermesh.cdb", "Ansys archive (HyperMesh)", "", "shells: 80"),
    Case("mapdl-archive", _CDB + "mixed_missing_midside.cdb", "Ansys archive", "", "some of its middle nodes"),
    Case("mapdl-archive", _CDB + "corrupt_a.cdb", "Ansys archive, damaged", "", "not a text file"),
    Case("unv2ccx", "examples/CylinderSolid.unv", "Universal file (Salome)", "twin", twin="examples/CylinderSolid.inp"),
    Case("unv2ccx", "examples/Yikun_Wang_Compound_Mesh.unv", "Universal file (Salome)"),
    Case("unv2ccx", "examples/116.unv", "Universal file (Salome)"),
    Case("unv2ccx", "examples/118.unv", "Universal file (Salome)", ""),
    Case("unv2ccx", "examples/113.unv", "Universal file (Salome)", ""),
    Case("unv2ccx", "examples/CylinderShell.unv", "Universal file (Salome)", "", "no solid elements"),
    Case("elmer", "ElmerGUI/samples/unv/box.unv", "Universal file (Salome)"),
    Case("libmesh", "examples/transient/transient_ex2/pipe-mesh.unv", "Universal file (I-DEAS)"),
    Case("mfem", "exodusii/simple-cube-tet10.e", "Exodus (Cubit)"),
    Case("mfem", "exodusii/simple-cube-hex27.e", "Exodus (Cubit)", ""),
    Case("mfem", "exodusii/simple-cube-wedge6.e", "Exodus (Cubit)"),
    Case("mfem", "exodusii/simple-cube-pyramid14.e", "Exodus (Cubit)", "", "PYRAMID14"),
    Case("libmesh", "tests/meshes/exodus_elements/read_exodus_HEX20.e", "Exodus (libMesh)"),
    Case("libmesh", "tests/meshes/exodus_elements/read_exodus_PRISM15.e", "Exodus (libMesh)"),
    Case("libmesh", "tests/meshes/geom_8.exo", "Exodus (Cubit)"),
    Case("libmesh", "tests/meshes/PressurizedCyl3d_Patch1_8Elem.e", "Exodus (Coreform)", "", "isogeometric"),
    Case("mfem", "gmsh/v22/unstructured_hex.v22.msh", "gmsh 2.2, text"),
    Case("mfem", "gmsh/v22/piece.bin.v22.msh", "gmsh 2.2, binary"),
    Case("mfem", "gmsh/v40/homology.asc.v40.msh", "gmsh 4.0, text"),
    Case("mfem", "gmsh/v40/piece.bin.v40.msh", "gmsh 4.0, binary"),
    Case("mfem", "gmsh/v41/homology.asc.v41.msh", "gmsh 4.1, text"),
    Case("libmesh", "tests/meshes/block.msh", "gmsh 2.2, text"),
    Case("elmer", "ElmerGUI/samples/gmsh/sinus0.msh", "gmsh 1", "", "MSH 1"),
    Case("aster", "astest/ahlv100b.mmed", "MED (Salome)"),
    Case("aster", "astest/ssls129c.mmed", "MED (Salome)"),
    Case("aster", "astest/rtool01b.mmed", "MED (Salome)"),
    Case("sfepy", "meshes/3d/beam_w14.vtk", "VTK", length="m"),
    Case("sfepy", "meshes/3d/hsphere8.vtk", "VTK", length="m"),
    Case("sfepy", "meshes/3d/cylinder.mesh", "Medit", length="m"),
    Case("sfepy", "meshes/3d/elbow2.mesh", "Medit", "", "inverted or flat"),
    Case("mfem", "vtk/bracket_appended_compressed.vtu", "VTU (ParaView)", "", "inverted or flat"),
    # tried after the readers were written
    Case("example-data", _WORK + "global.cdb", "Ansys archive (Workbench)"),
    Case("example-data", _WORK + "local.cdb", "Ansys archive (Workbench)"),
    Case("example-data", "pyprimemesh/turbine_blade/blade.cdb", "Ansys archive (Workbench)"),
    Case("example-data", _TUREK + "turek_hron_benchmark_solid.cdb", "Ansys archive", ignore=("DBLOCK",), length="m"),
    Case("example-data", _TUREK + "turek_hron_solid_model.cdb", "Ansys archive", ignore=("D",), length="m"),
    Case("example-data", "tech_demos/td-20/pcb_mesh_file.cdb", "Ansys archive", "", "shells: 4346"),
    Case("seacas", _IOSS + "8-block.g", "Exodus (Cubit)"),
    Case("seacas", _IOSS + "cube.g", "Exodus (Cubit)"),
    Case("seacas", "packages/seacas/scripts/tests/exomerge_unit_test.e", "Exodus", "", "pairs of nodes coincide"),
    Case("exodus.jl", "test/mesh/cube_meshes/mesh_test.g", "Exodus (Cubit)"),
    Case("exodus.jl", "misc/hole_array.exo", "Exodus", "", "do not have three coordinates"),
    Case("smesh", "doc/examples/data/test_04.med", "MED (Salome)"),
    Case("smesh", "doc/examples/data/test_13.med", "MED (Salome)"),
    Case("smesh", _PADDER + "concrete.med", "MED 2 (Salome)", "", "MED of a version before 3"),
    Case("dealii", "tests/grid/grid_in_unv_3d/3D.unv", "Universal file (Salome)"),
    Case("dealii", "tests/grid/grid_in_unv_3d/salome_cube.unv", "Universal file (Salome)"),
    Case("dealii", "examples/step-97/sphere_r6.msh", "gmsh 2.2, text"),
    Case("vtk-data", "Data/Hexahedron.vtu", "VTU (VTK)"),
    Case("vtk-data", "Data/QuadraticTetra.vtu", "VTU (VTK)"),
    Case("vtk-data", "Data/QuadraticWedge.vtu", "VTU (VTK)"),
    Case("vtk-data", "Data/QuadraticPyramid.vtu", "VTU (VTK)", ""),
    Case("vtk-data", "Data/AngularSector.vtk", "VTK", "", "pairs of nodes coincide"),
    Case("vtk-data", "Data/PentaHexa.vtk", "VTK", "", "cells of type penta_prism"),
    Case("cae", "examples/default.inp", "CalculiX deck", "", "does not fit its neighbours", _SUPPORTS),
]

"""Names that sensors of a scene use, checked before any link is reduced."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import msgspec

from erls.errors import SceneError
from erls.mechanism.sensors.base import SensorRecord
from erls.scene.checks import bad, check_names
from fe_import.files.toml import choose


def check_sensors(
    sensors: Sequence[SensorRecord], file: str, known: Mapping[str, Collection[str]], taken: Collection[str]
) -> None:
    """Refuse names that are not there, and those that columns of tables have already.

    Parameters
    ----------
    sensors : sequence of SensorRecord
    file : str
        Name of the file, for messages.
    known : mapping of str to names
        What a field of that name may name.
    taken : collection of str
        Names of points, joints and other columns.

    Raises
    ------
    SceneError
        BAD_FIELD, BAD_REFERENCE.
    """
    check_names([(f"{file}: sensors[{k}].name", sensor.name) for k, sensor in enumerate(sensors)])
    for k, sensor in enumerate(sensors):
        place = f"{file}: sensors[{k}]"
        if sensor.name in taken:
            message = "a point, joint or column has this name already, and tables hold both"
            raise bad(f"{place}.name", message, sensor.name, "rename the sensor")
        for field, names in known.items():
            if field in sensor.__struct_fields__:
                choose(msgspec.structs.asdict(sensor)[field], names, f"{place}.{field}", SceneError)

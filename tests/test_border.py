import lidar_deflect._native as native


def test_the_compiled_part_and_the_package_are_of_one_version() -> None:
    from importlib.metadata import version

    assert native.__version__ == version("lidar-deflect")

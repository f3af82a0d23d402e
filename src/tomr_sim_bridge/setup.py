"""Build description of tomr_sim_bridge for colcon and pip."""

from glob import glob

from setuptools import find_packages, setup

NAME = "tomr_sim_bridge"

setup(
    name=NAME,
    version="0.2.0",
    description="A simulated three-wheeled omni robot with faults to try, and a bag player.",
    maintainer="TOMR maintainers",
    maintainer_email="maintainers@tomr.dev",
    license="Apache-2.0",
    python_requires=">=3.11",
    packages=find_packages(include=[NAME, f"{NAME}.*"]),
    package_data={NAME: ["py.typed", "missions/*.yaml"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/launch", sorted(glob("launch/*.launch.py"))),
        (f"share/{NAME}/missions", sorted(glob(f"{NAME}/missions/*.yaml"))),
    ],
    install_requires=["setuptools"],
    extras_require={"test": ["pytest"]},
    zip_safe=False,
    entry_points={
        "console_scripts": [
            f"sim_bridge = {NAME}.entry:sim_bridge",
            f"bag_replay = {NAME}.entry:bag_replay",
            f"tomr_simulate = {NAME}.entry:tomr_simulate",
            f"tomr_import_robotino = {NAME}.entry:tomr_import_robotino",
        ],
    },
)

"""Build description of tomr_odometry for colcon and pip."""

from glob import glob

from setuptools import find_packages, setup

NAME = "tomr_odometry"

setup(
    name=NAME,
    version="0.2.0",
    description="Odometry of an omni robot that knows of slip, from encoders, power and an IMU.",
    maintainer="TOMR maintainers",
    maintainer_email="maintainers@tomr.dev",
    license="Apache-2.0",
    python_requires=">=3.11",
    packages=find_packages(include=[NAME, f"{NAME}.*"]),
    package_data={NAME: ["py.typed"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/launch", sorted(glob("launch/*.launch.py"))),
    ],
    install_requires=["setuptools"],
    extras_require={"test": ["pytest"]},
    zip_safe=False,
    entry_points={
        "console_scripts": [
            f"slip_odometry = {NAME}.entry:slip_odometry",
            f"tomr_odometry = {NAME}.entry:tomr_odometry",
        ],
    },
)

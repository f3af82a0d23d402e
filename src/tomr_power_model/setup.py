"""Build description of tomr_power_model for colcon and pip."""

from glob import glob

from setuptools import find_packages, setup

NAME = "tomr_power_model"

setup(
    name=NAME,
    version="0.2.0",
    description="Electrical power of a three-wheeled omni robot, predicted from its motion.",
    maintainer="TOMR maintainers",
    maintainer_email="maintainers@tomr.dev",
    license="Apache-2.0",
    python_requires=">=3.11",
    packages=find_packages(include=[NAME, f"{NAME}.*"]),
    package_data={NAME: ["py.typed", "robots/*.yaml", "calibration/*.j2"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/robots", sorted(glob(f"{NAME}/robots/*.yaml"))),
    ],
    install_requires=["setuptools"],
    extras_require={"test": ["pytest"]},
    zip_safe=False,
    entry_points={
        "console_scripts": [
            f"power_model = {NAME}.entry:power_model",
            f"tomr_calibrate = {NAME}.entry:tomr_calibrate",
        ],
    },
)

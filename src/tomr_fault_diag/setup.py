"""Build description of tomr_fault_diag for colcon and pip."""

from glob import glob

from setuptools import find_packages, setup

NAME = "tomr_fault_diag"

setup(
    name=NAME,
    version="0.2.0",
    description="Faults of a three-wheeled omni robot, detected in its motors' power.",
    maintainer="TOMR maintainers",
    maintainer_email="maintainers@tomr.dev",
    license="Apache-2.0",
    python_requires=">=3.11",
    packages=find_packages(include=[NAME, f"{NAME}.*"]),
    package_data={NAME: ["py.typed", "weights/*.npz", "weights/*.json", "diagnosis/*.j2"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
        (f"share/{NAME}/launch", sorted(glob("launch/*.launch.py"))),
        (f"share/{NAME}/config", sorted(glob("config/*"))),
    ],
    install_requires=["setuptools"],
    extras_require={"test": ["pytest"]},
    zip_safe=False,
    entry_points={
        "console_scripts": [
            f"power_residuals = {NAME}.entry:power_residuals",
            f"fault_classifier = {NAME}.entry:fault_classifier",
            f"tomr_diagnose = {NAME}.entry:tomr_diagnose",
            f"tomr_diagnosis = {NAME}.entry:tomr_diagnosis",
        ],
    },
)

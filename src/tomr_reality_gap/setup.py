"""Build description of tomr_reality_gap for colcon and pip."""

from setuptools import find_packages, setup

NAME = "tomr_reality_gap"

setup(
    name=NAME,
    version="0.2.0",
    description="What a robot's simulation leaves out, found in recordings of the real one.",
    maintainer="TOMR maintainers",
    maintainer_email="maintainers@tomr.dev",
    license="Apache-2.0",
    python_requires=">=3.11",
    packages=find_packages(include=[NAME, f"{NAME}.*"]),
    package_data={NAME: ["py.typed", "report/*.j2", "fleet/*.j2"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
    ],
    install_requires=["setuptools"],
    extras_require={"fleet": ["distributed"], "test": ["pytest"]},
    zip_safe=False,
    entry_points={"console_scripts": [f"tomr_gap = {NAME}.entry:tomr_gap"]},
)

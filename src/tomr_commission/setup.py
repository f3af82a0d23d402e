"""Build description of tomr_commission for colcon and pip."""

from setuptools import find_packages, setup

NAME = "tomr_commission"

setup(
    name=NAME,
    version="0.2.0",
    description="From healthy drives of one robot to a diagnosis with a measured false-alarm rate.",
    maintainer="TOMR maintainers",
    maintainer_email="maintainers@tomr.dev",
    license="Apache-2.0",
    python_requires=">=3.11",
    packages=find_packages(include=[NAME, f"{NAME}.*"]),
    package_data={NAME: ["py.typed", "report/*.j2"]},
    data_files=[
        ("share/ament_index/resource_index/packages", [f"resource/{NAME}"]),
        (f"share/{NAME}", ["package.xml"]),
    ],
    install_requires=["setuptools"],
    extras_require={"test": ["pytest"]},
    zip_safe=False,
    entry_points={"console_scripts": [f"tomr_commission = {NAME}.entry:tomr_commission"]},
)

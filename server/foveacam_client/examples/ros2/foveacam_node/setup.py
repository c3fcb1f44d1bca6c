"""Installs the node for colcon."""

from setuptools import setup

setup(
    name="foveacam_node",
    version="0.1.0",
    packages=["foveacam_node"],
    data_files=[
        ("share/ament_index/resource_index/packages", ["resource/foveacam_node"]),
        ("share/foveacam_node", ["package.xml"]),
    ],
    install_requires=["setuptools"],
    entry_points={"console_scripts": ["node = foveacam_node.node:main"]},
)

"""The losses in somebody else's LightningModule, in the manner of 4D-Humans' (needs torch and lightning).

`Theirs` stands for it; `WithPhysics` is all that is added. Run:    python examples/05_physics_in_your_trainer.py
"""

import lightning
import torch

import ipman_rs.torch as ipt

body = ipt.BodyModel("anny-lite")


class Theirs(lightning.LightningModule):
    def __init__(self):
        super().__init__()
        head = torch.nn.Linear(128, 144)
        torch.nn.init.zeros_(head.weight)
        self.network = torch.nn.Sequential(torch.nn.Conv2d(3, 8, 16, 16), torch.nn.Flatten(), head)

    def forward_step(self, batch):
        start = torch.tensor([1.0, 0, 0, 0, 1, 0]).repeat(24, 1)
        start[0, 4] = -1  # upright where y runs down
        posed = body(start + self.network(batch["img"]).reshape(-1, 24, 6))
        return {"pred_vertices": posed.vertices, "pred_keypoints_3d": posed.joints}

    def compute_loss(self, batch, output):
        found, labels = output["pred_keypoints_3d"], batch["keypoints_3d"]
        return 5 * (found - found[:, :1] - labels + labels[:, :1]).abs().mean()


class WithPhysics(Theirs):
    physics = ipt.IntuitivePhysicsLoss(body.template, "balanced", weights={"balance": 0.5, "pull": 0.3, "push": 0.3})

    def compute_loss(self, batch, output):
        vertices, root = output["pred_vertices"], output["pred_keypoints_3d"][:, 0]
        turned, _ = ipt.camera_to_world(vertices - root[:, None], 0 * root, batch["cam_R"], 0 * root)
        world = turned + batch["pelvis_world"][:, None]
        return super().compute_loss(batch, output) + self.physics.weighted(world, batch["ground"])[0]


if __name__ == "__main__":
    torch.manual_seed(0)
    rest, camera = body(), torch.diag(torch.tensor([1.0, -1, -1]))  # a level camera: x right, y down, z forward
    lean = torch.linalg.matrix_exp(0.25 * torch.tensor([[0.0, 0, 0], [0, 0, -1], [0, 1, 0]]))  # of labels: 14 degrees
    pelvis = rest.joints[0] - rest.vertices[:, 1].min() * torch.tensor([0.0, 1, 0])
    batch = {"img": torch.rand(8, 3, 64, 64), "keypoints_3d": (rest.joints @ (camera @ lean).T).expand(8, -1, -1)}
    batch |= {"cam_R": camera.expand(8, 3, 3), "pelvis_world": pelvis.expand(8, 3), "ground": ipt.Ground.y_up()}
    for kind in (Theirs, WithPhysics):
        torch.manual_seed(0)
        optimizer = torch.optim.Adam((module := kind()).parameters(), lr=1e-3)
        for _ in range(120):
            loss = module.compute_loss(batch, output := module.forward_step(batch))
            optimizer.zero_grad()
            loss.backward()
            optimizer.step()
        error = 1e3 * Theirs.compute_loss(module, batch, output) / 5
        terms = WithPhysics.physics(output["pred_vertices"] @ camera + pelvis - rest.joints[0], batch["ground"])
        print(f"{kind.__name__}: keypoints off by {error:.0f} mm, balance cost {terms['balance']:.2f}")

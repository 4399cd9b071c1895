// Finds objects, as importers make them at run time, in the bake that is the first line of standard input. Each other line has
// names from a Haptic Object on, materials, and the index of the touched one or nothing: "Scene|Cup<TAB>Clay|Glaze<TAB>1".
using System;
using System.Linq;
using HapticVLM;
using HapticVLM.Baked;
using UnityEngine;

public static class Imported
{
    static void Find()
    {
        object surfaces = Components.Private<object>(FeltRooms.Client(null), "surfaces");
        surfaces.GetType().GetProperty("Baked").SetValue(surfaces, BakedScene.Open(Console.In.ReadLine()));
        for (string line = Console.In.ReadLine(); line != null; line = Console.In.ReadLine())
        {
            string[] fields = line.Split('\t');
            GameObject[] chain = Array.ConvertAll(fields[0].Split('|'), name => new GameObject(name));
            for (int at = 1; at < chain.Length; at++) chain[at].transform.SetParent(chain[at - 1].transform, false);
            chain[0].AddComponent<HapticObject>();
            var renderer = chain.Last().AddComponent<MeshRenderer>();
            renderer.sharedMaterials = Array.ConvertAll(fields[1].Split('|'), name => new Material { name = name });
            chain.Last().AddComponent<BoxCollider>().sharedMaterial = new PhysicMaterial { name = "Ice" }; // a name for the service alone
            FeltSurface felt = BakedFeel.Find(chain.Last(), fields[2] == "" ? null : renderer.sharedMaterials[int.Parse(fields[2])]);
            Components.Say("felt " + (felt == null ? "nothing" : felt.Material));
        }
    }
}

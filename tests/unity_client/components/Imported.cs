// Finds objects, as importers make them at run time, in the bake that is the first line of standard input. Each other line has
// names from a Haptic Object on, each behind those of its siblings, materials, and the index of the touched one or nothing:
// "Scene|Fork;Cup<TAB>Clay|Glaze<TAB>1".
using System;
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
            GameObject touched = null;
            foreach (string siblings in fields[0].Split('|'))
            {
                Transform parent = touched == null ? null : touched.transform;
                foreach (string name in siblings.Split(';'))
                {
                    touched = new GameObject(name);
                    touched.transform.SetParent(parent, false);
                }
            }
            touched.transform.root.gameObject.AddComponent<HapticObject>();
            var renderer = touched.AddComponent<MeshRenderer>();
            renderer.sharedMaterials = Array.ConvertAll(fields[1].Split('|'), name => new Material { name = name });
            touched.AddComponent<BoxCollider>().sharedMaterial = new PhysicMaterial { name = "Ice" }; // a name for the service alone
            FeltSurface felt = BakedFeel.Find(touched, fields[2] == "" ? null : renderer.sharedMaterials[int.Parse(fields[2])]);
            Components.Say("felt " + (felt == null ? "nothing" : felt.Material));
        }
    }
}

"""Java's ``ColorConvertOp``, as QuPath calls it: LittleCMS with Java's own sRGB profile, 8 bit in, 8 bit out."""

from functools import cache, partial

from tests.consumers import Consumer, Job, Picture, first_line, program, read_image, run

#: Assign a profile to a picture and convert the picture to sRGB. Arguments: profile, picture, result.
_SHOW = """
import java.awt.color.*;
import java.awt.image.*;
import java.io.File;
import javax.imageio.ImageIO;

public class Show {
    public static void main(String[] words) throws Exception {
        ICC_ColorSpace space = new ICC_ColorSpace(ICC_Profile.getInstance(words[0]));
        BufferedImage image = ImageIO.read(new File(words[1]));
        ColorModel model = new ComponentColorModel(space, false, false, ColorModel.OPAQUE, DataBuffer.TYPE_BYTE);
        WritableRaster raster = model.createCompatibleWritableRaster(image.getWidth(), image.getHeight());
        raster.setRect(image.getRaster());
        BufferedImage shown = new BufferedImage(image.getWidth(), image.getHeight(), BufferedImage.TYPE_INT_RGB);
        new ColorConvertOp(null).filter(new BufferedImage(model, raster, false, null), shown);
        ImageIO.write(shown, "png", new File(words[2]));
    }
}
"""


def tool() -> str:
    return program("java", "default-jdk-headless")


@cache
def version() -> str:
    return first_line(run(tool(), "--version")).split()[1]


def profile(job: Job, form: str) -> Picture:
    source, result = job.scratch / "Show.java", job.scratch / "java.png"
    source.write_text(_SHOW)
    result.unlink(missing_ok=True)
    run(tool(), "-Djava.awt.headless=true", source, job.lut(form), job.png8, result)
    return read_image(result)


CONSUMERS = [
    Consumer("Java ColorConvertOp", version, "aged.icc", "tetrahedral", partial(profile, form="icc")),
    Consumer("Java ColorConvertOp", version, "aged-v2.icc", "tetrahedral", partial(profile, form="icc-v2")),
    Consumer("Java ColorConvertOp", version, "aged-matrix.icc", "matrix", partial(profile, form="icc-matrix")),
]
